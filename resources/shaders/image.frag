in vec2 at;
uniform sampler2D image;
uniform vec4 tint;   // factor on the colour, opacity
layout(location = 0) out vec4 out_color;

void main()
{
    vec4 c = textureLod(image, at, 0.0);
    out_color = vec4(c.rgb * tint.rgb, 1.0) * (c.a * tint.a);
}
