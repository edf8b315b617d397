// What reaches a point: the key light through skin and coat (deep opacity maps, Yuksel and Keyser 2008), fill, rim, sky.
uniform vec3 key_direction, fill_direction, rim_direction, up_direction;
uniform vec3 key_color, fill_color, rim_color, sky_color, ground_color;
uniform sampler2D first_depth;    // nearest hair or skin seen from the key light
uniform sampler2D skin_depth;     // nearest skin alone
uniform sampler2D coat_opacity;   // hair in front of four depths behind the first, summed widths over texel
uniform mat4 light_from_world;
uniform vec4 layer_ends;          // those depths, metres
uniform float light_range;        // metres from depth 0 to depth 1
uniform float skin_bias;          // metres
uniform float tap_spread;         // texels
uniform int tap_reach;            // taps on each side: 1 gives nine, 0 one
uniform vec3 eye_position;
uniform vec3 eye_backward;        // towards the viewer
uniform bool parallel_view;

vec3 to_viewer(vec3 p)
{
    return parallel_view ? eye_backward : normalize(eye_position - p);
}

float hair_in_front(float behind, vec4 sums)
{
    if (behind <= 0.0) return 0.0;
    if (behind < layer_ends.x) return sums.x * behind / layer_ends.x;
    if (behind < layer_ends.y) return mix(sums.x, sums.y, (behind - layer_ends.x) / (layer_ends.y - layer_ends.x));
    if (behind < layer_ends.z) return mix(sums.y, sums.z, (behind - layer_ends.y) / (layer_ends.z - layer_ends.y));
    return mix(sums.z, sums.w, min((behind - layer_ends.z) / (layer_ends.w - layer_ends.z), 1.0));
}

// x: part of the key light not blocked by skin; y: optical depth of the hair in the way.
vec2 key_light(vec3 p)
{
    vec3 q = (light_from_world * vec4(p, 1.0)).xyz * 0.5 + 0.5;
    vec2 texel = tap_spread / vec2(textureSize(first_depth, 0));
    float open = 0.0, depth = 0.0, total = 4.0 + 12.0 * float(tap_reach);
    for (int j = -tap_reach; j <= tap_reach; ++j) {
        for (int i = -tap_reach; i <= tap_reach; ++i) {
            vec2 uv = q.xy + vec2(i, j) * texel;
            float weight = (i == 0 ? 2.0 : 1.0) * (j == 0 ? 2.0 : 1.0) / total;
            float behind_skin = (q.z - textureLod(skin_depth, uv, 0.0).r) * light_range;
            open += weight * (1.0 - clamp(behind_skin / skin_bias - 1.0, 0.0, 1.0));
            float behind = (q.z - textureLod(first_depth, uv, 0.0).r) * light_range;
            depth += weight * hair_in_front(behind, textureLod(coat_opacity, uv, 0.0));
        }
    }
    return vec2(open, depth);
}
