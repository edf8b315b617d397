// Samples to pixels: box filter, filmic curve, background, sRGB. With nothing behind: times what is covered.
in vec2 unused;
uniform sampler2D samples;
uniform int samples_per_side;
uniform bool clear;
uniform vec2 origin;            // of this tile in the picture, pixels from the bottom left
layout(location = 0) out vec4 out_color;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy - origin);
    vec4 sum = vec4(0.0);
    for (int j = 0; j < samples_per_side; ++j)
        for (int i = 0; i < samples_per_side; ++i)
            sum += texelFetch(samples, pixel * samples_per_side + ivec2(i, j), 0);
    sum /= float(samples_per_side * samples_per_side);
    if (clear) {
        vec3 seen = to_srgb(filmic(exposure * sum.rgb / max(sum.a, 1e-6)));
        out_color = vec4(seen, 1.0) * min(sum.a, 1.0);
        return;
    }
    vec3 display = background(gl_FragCoord.xy);
    if (sum.a > 0.0)
        display = to_srgb(mix(to_linear(display), filmic(exposure * sum.rgb / sum.a), min(sum.a, 1.0)));
    out_color = vec4(display + dither(gl_FragCoord.xy), 1.0);
}
