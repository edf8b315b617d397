// A line from a to b with round ends, a circle about a, or the box from a to b: a box around it, in pixels, y down.
uniform vec2 picture_size;
in vec4 in_ends;       // a, b
in vec4 in_shape;      // radius (0 for a line, -1 for a box, whose width is 0), half width, way along a dashed line before a or -1, unused
in vec4 in_color;
out vec2 at;
flat out vec4 ends;
flat out vec4 shape;
flat out vec4 color;

void main()
{
    float reach = in_shape.x + in_shape.y + 1.0;
    vec2 low = min(in_ends.xy, in_ends.zw) - reach, high = max(in_ends.xy, in_ends.zw) + reach;
    at = mix(low, high, vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)));
    ends = in_ends;
    shape = in_shape;
    color = in_color;
    vec2 clip = (at + 0.5) / picture_size * 2.0 - 1.0;
    gl_Position = vec4(clip.x, -clip.y, 0.0, 1.0);
}
