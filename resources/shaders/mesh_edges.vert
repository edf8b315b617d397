// Edges lie on the triangles they belong to: they are drawn a hair's breadth nearer.
uniform mat4 clip_from_world;
uniform float nearer;
in vec3 in_position;

void main()
{
    gl_Position = clip_from_world * vec4(in_position, 1.0);
    gl_Position.z -= nearer * gl_Position.w;
}
