// Samples to pixels: box filter, filmic curve, background, sRGB, half a step of dither against bands.
in vec2 unused;
uniform sampler2D samples;
uniform int samples_per_side;
uniform vec2 origin;            // of this tile in the picture, pixels from the bottom left
uniform float picture_height;
uniform vec3 top_color, bottom_color;   // display
uniform float exposure;
layout(location = 0) out vec4 out_color;

vec3 filmic(vec3 x)   // fit of the ACES curve by Narkowicz 2015
{
    x *= 0.8;
    return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

vec3 to_linear(vec3 c)
{
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}

vec3 to_srgb(vec3 c)
{
    return mix(c * 12.92, 1.055 * pow(max(c, 0.0), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy - origin);
    vec4 sum = vec4(0.0);
    for (int j = 0; j < samples_per_side; ++j)
        for (int i = 0; i < samples_per_side; ++i)
            sum += texelFetch(samples, pixel * samples_per_side + ivec2(i, j), 0);
    sum /= float(samples_per_side * samples_per_side);
    float height = gl_FragCoord.y / picture_height;
    vec3 display = mix(bottom_color, top_color, height);
    if (sum.a > 0.0)
        display = to_srgb(mix(to_linear(display), filmic(exposure * sum.rgb / sum.a), min(sum.a, 1.0)));
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    out_color = vec4(display + (noise - 0.5) / 255.0, 1.0);
}
