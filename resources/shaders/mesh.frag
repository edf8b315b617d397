// Skin: matte, lit by the same lights through the same coat.
in vec3 position;
in vec3 normal;
uniform vec3 surface_color;
uniform float absorption;
uniform float covered;   // 1 under a coat, where little light of the sky arrives
layout(location = 0) out vec4 out_color;

void main()
{
    vec3 v = to_viewer(position);
    vec3 n = normalize(normal + 1e-12);
    if (dot(n, v) < 0.0 && !gl_FrontFacing) n = -n;
    vec2 key = key_light(position);
    float facing = max(dot(n, key_direction), 0.0);
    vec3 light = key_color * key.x * exp(-key.y * absorption) * facing * 0.32;
    light += fill_color * clamp((dot(n, fill_direction) + 0.3) / 1.3, 0.0, 1.0) * 0.45 * (1.0 - 0.7 * covered);
    light += mix(ground_color, sky_color, 0.5 + 0.5 * dot(n, up_direction)) * 0.5 * (1.0 - 0.7 * covered);
    vec3 h = normalize(key_direction + v);
    vec3 gleam = key_color * key.x * facing * pow(max(dot(n, h), 0.0), 30.0) * 0.035 * (1.0 - covered);
    float edge = pow(1.0 - clamp(dot(n, v), 0.0, 1.0), 3.0);
    vec3 rim = rim_color * edge * clamp(dot(n, rim_direction) + 0.2, 0.0, 1.0) * 0.25 * (1.0 - covered);
    out_color = vec4(surface_color * (light + rim) + gleam, 1.0);
}
