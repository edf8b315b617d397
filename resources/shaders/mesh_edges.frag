uniform vec4 edge_color;   // light, and how much of it
layout(location = 0) out vec4 out_color;

void main()
{
    out_color = vec4(shown(edge_color.rgb), 1.0) * edge_color.a;
}
