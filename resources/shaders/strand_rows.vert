// Where points are worked out: one triangle over the whole viewport, or, of some strands alone, a quad over the texels
// of each; then the vertex number says strand and corner.
out vec2 unused;
uniform bool some_alone;
uniform vec2 texels;   // of the textures, in both directions

void main()
{
    vec2 p = vec2(float((gl_VertexID & 1) << 2) - 1.0, float((gl_VertexID & 2) << 1) - 1.0);
    if (some_alone) {
        int strand = gl_VertexID >> 2;
        int row = strand / strands_per_row;
        int column = (strand - row * strands_per_row + (gl_VertexID & 1)) * points_per_strand;
        p = 2.0 * vec2(column, row + ((gl_VertexID >> 1) & 1)) / texels - 1.0;
    }
    unused = p;
    gl_Position = vec4(p, 0.0, 1.0);
}
