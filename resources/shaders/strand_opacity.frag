// Adds the hair to every layer that ends behind it (Yuksel and Keyser 2008).
uniform sampler2D first_depth;
uniform vec4 layer_ends;
uniform float light_range;
uniform float opacity;   // width over texel
layout(location = 0) out vec4 out_sums;

void main()
{
    float behind = (gl_FragCoord.z - texelFetch(first_depth, ivec2(gl_FragCoord.xy), 0).r) * light_range;
    out_sums = opacity * vec4(lessThan(vec4(behind), vec4(layer_ends.xyz, 1e30)));
}
