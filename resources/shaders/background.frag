// The background alone.
in vec2 unused;
layout(location = 0) out vec4 out_color;

void main()
{
    out_color = vec4(background(gl_FragCoord.xy) + dither(gl_FragCoord.xy), 1.0);
}
