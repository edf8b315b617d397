// Guides: a colour by state and a constant width in pixels, tapering a little to the tip.
in vec2 unused;
uniform sampler2D strand_tints;    // rgb colour, opacity
uniform int strand_count;
uniform float line_pixels;
uniform mat4 clip_from_world;
uniform vec2 picture_size;
layout(location = 0) out vec4 out_side;
layout(location = 1) out vec4 out_color;

void main()
{
    int column = int(gl_FragCoord.x), row = int(gl_FragCoord.y);
    int in_row = column / points_per_strand;
    int point = column - in_row * points_per_strand;
    int strand = row * strands_per_row + in_row;
    if (strand >= strand_count) discard;
    int last = points_per_strand - 1;
    float u = float(point) / float(last);
    vec4 a = clip_from_world * vec4(strand_point(strand, max(point - 1, 0)), 1.0);
    vec4 b = clip_from_world * vec4(strand_point(strand, min(point + 1, last)), 1.0);
    vec2 line = (b.xy / max(b.w, 1e-6) - a.xy / max(a.w, 1e-6)) * picture_size;
    float length2 = dot(line, line);
    vec2 side = length2 > 1e-12 ? vec2(-line.y, line.x) * inversesqrt(length2) : vec2(1.0, 0.0);
    out_side = vec4(side, 0.5 * line_pixels * mix(1.0, 0.6, u), 1.0);
    vec4 tint = texelFetch(strand_tints, ivec2(in_row, row), 0);
    out_color = vec4(shown(tint.rgb), tint.a);
}
