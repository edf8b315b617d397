// Skin: matte, lit by the same lights through the same coat; or clay, or flat; or colours of a map.
uniform vec3 surface_color;
uniform float absorption;
uniform float covered;   // 1 under a coat, where little light of the sky arrives
uniform bool stands_for_hair;   // of a moving picture, under a sparse coat: as the coat looks between its hairs
uniform int manner;      // 0 in light, 1 clay (lit by the view alone), 2 flat
uniform bool show_map;
uniform sampler2D ramp;   // rows of colours: of a flat map, and in light of values and of signed ones
uniform int ramp_row;
uniform float opacity;   // 1, or of a ghost: more at its edges
uniform vec3 view_right, view_up;

vec3 clay(vec3 n, vec3 v, vec3 color)
{
    vec2 at = vec2(dot(n, view_right), dot(n, view_up));
    float toward = clamp(dot(n, v), 0.0, 1.0);
    float key = clamp(dot(vec3(at, toward), normalize(vec3(-0.45, 0.62, 0.65))), 0.0, 1.0);
    float fill = clamp(0.5 + 0.5 * dot(vec3(at, toward), normalize(vec3(0.7, -0.5, 0.3))), 0.0, 1.0);
    float edge = pow(1.0 - toward, 2.5);
    return color * (0.16 + 1.15 * key + 0.22 * fill) * (1.0 - 0.55 * edge) + vec3(0.10) * pow(key, 24.0);
}

vec3 in_light(vec3 position, vec3 n, vec3 v, vec3 color)
{
    vec2 key = key_light(position);
    float facing = max(dot(n, key_direction), 0.0);
    float through = stands_for_hair ? 0.62 : exp(-key.y * absorption);
    vec3 light = key_color * key.x * through * facing * 0.32;
    float dim = stands_for_hair ? 0.6 : 1.0 - 0.7 * covered;
    light += fill_color * clamp((dot(n, fill_direction) + 0.3) / 1.3, 0.0, 1.0) * 0.45 * dim;
    light += mix(ground_color, sky_color, 0.5 + 0.5 * dot(n, up_direction)) * 0.5 * dim;
    vec3 h = normalize(key_direction + v);
    vec3 gleam = key_color * key.x * facing * pow(max(dot(n, h), 0.0), 30.0) * 0.035 * (1.0 - covered);
    float edge = pow(1.0 - clamp(dot(n, v), 0.0, 1.0), 3.0);
    vec3 rim = rim_color * edge * clamp(dot(n, rim_direction) + 0.2, 0.0, 1.0) * 0.25 * (1.0 - covered);
    return color * (light + rim) + gleam;
}

vec4 skin(vec3 position, vec3 n, vec3 v, float value)
{
    float toward = clamp(abs(dot(n, v)), 0.0, 1.0);
    float alpha = opacity < 1.0 ? mix(0.55, opacity, sqrt(toward)) : 1.0;
    vec3 light;
    if (show_map) {
        vec2 place = vec2((clamp(value, 0.0, 1.0) * 255.0 + 0.5) / 256.0, (float(ramp_row) + 0.5) / 3.0);
        light = textureLod(ramp, place, 0.0).rgb;
        light = ramp_row > 0 ? clay(n, v, light) : light * (0.62 + 0.38 * toward);
    }
    else if (manner == 2) light = surface_color;
    else if (manner == 1) light = clay(n, v, surface_color);
    else light = in_light(position, n, v, surface_color);
    return vec4(shown(light), 1.0) * alpha;
}
