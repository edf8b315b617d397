// From light to what a screen shows.
uniform float exposure;
uniform bool to_display;   // the target holds what is shown; else light, which is resolved later

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

vec3 shown(vec3 light)
{
    return to_display ? to_srgb(filmic(exposure * light)) : light;
}
