// A picture as it is, in a part of the screen.
in vec2 unused;
uniform sampler2D picture;
uniform ivec2 corner;   // lower left, pixels
layout(location = 0) out vec4 out_color;

void main()
{
    out_color = texelFetch(picture, ivec2(gl_FragCoord.xy) - corner, 0);
}
