// Where hair has moved: what is behind it again, colour and depth.
in float from_middle;
in float half_width;
uniform sampler2D base_color;
uniform sampler2D base_depth;
layout(location = 0) out vec4 out_color;

void main()
{
    if (abs(from_middle) > half_width) discard;
    ivec2 at = ivec2(gl_FragCoord.xy);
    out_color = texelFetch(base_color, at, 0);
    gl_FragDepth = texelFetch(base_depth, at, 0).r;
}
