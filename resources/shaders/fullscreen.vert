// One triangle over the whole viewport, made from nothing.
out vec2 unused;

void main()
{
    vec2 p = vec2(float((gl_VertexID & 1) << 2) - 1.0, float((gl_VertexID & 2) << 1) - 1.0);
    unused = p;
    gl_Position = vec4(p, 0.0, 1.0);
}
