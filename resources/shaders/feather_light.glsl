// A thin sheet of parallel fibres: light from before and from behind, a highlight square to the barbs (Kajiya and Kay
// 1989, so that both sides of a feather shine from different views), and the colours of a thin film.
uniform float film_index, film_spread;

vec3 film_color(float cosine, float thickness)
{
    float inside = sqrt(max(1.0 - (1.0 - cosine * cosine) / (film_index * film_index), 0.0));
    float path = 2.0 * film_index * thickness * inside;
    return 0.5 - 0.5 * cos(6.2831853 * path / vec3(612.0, 549.0, 465.0));   // half a wave is lost at the first face
}

vec3 lit_by(vec3 l, vec3 strength, vec3 n, vec3 t, vec3 v, vec3 body, vec4 light_of, vec2 film)
{
    float facing = dot(n, l);
    float wrapped = clamp((facing + 0.25) / 1.25, 0.0, 1.0);
    float sin_l = sqrt(max(1.0 - dot(t, l) * dot(t, l), 0.0));
    vec3 diffuse = body * wrapped * mix(1.0, sin_l, 0.5 * light_of.z);
    vec3 through = pow(body, vec3(0.8)) * light_of.w * clamp(-facing, 0.0, 1.0);
    vec3 h = normalize(l + v + 1e-6);
    float along = (dot(t, l) + dot(t, v)) / (2.0 * light_of.y);
    float fibres = exp(-along * along) * sin_l;
    float off = acos(clamp(dot(n, h), -1.0, 1.0)) / light_of.y;
    float sheet = exp(-off * off);
    float gate = smoothstep(-0.15, 0.35, facing) * (0.35 + 0.65 * pow(1.0 - clamp(dot(h, v), 0.0, 1.0), 3.0) + 0.25);
    vec3 shine = mix(vec3(1.0), body / max(max(body.r, body.g), max(body.b, 1e-3)), 0.5);
    vec3 gloss = 0.22 * light_of.x * mix(sheet, 0.55 * fibres, light_of.z) * gate * shine;
    float wide = acos(clamp(dot(n, h), -1.0, 1.0)) / film_spread;
    vec3 colored = film.x * film_color(clamp(dot(h, v), 0.0, 1.0), film.y) * exp(-wide * wide) * clamp(facing * 3.0, 0.0, 1.0);
    return strength * (0.30 * (diffuse + through) + gloss + 0.28 * colored);
}

// light_of: gloss, roughness, anisotropy, transmission; film: strength, nanometres; back: the underside is seen.
vec3 lit_feather(vec3 position, vec3 normal, vec3 fibre, vec3 body, vec4 light_of, vec2 film, bool back)
{
    vec3 v = to_viewer(position);
    vec3 n = normalize(normal + 1e-9);
    vec3 t = normalize(fibre + 1e-9);
    if (back) n = -n;
    if (dot(n, v) < 0.0) n = normalize(n - 1.02 * dot(n, v) * v);
    vec2 key = key_light(position);
    vec3 lit = lit_by(key_direction, key_color * key.x * exp(-0.5 * key.y), n, t, v, body, light_of, film);
    lit += lit_by(fill_direction, fill_color, n, t, v, body, light_of, film);
    float edge = 1.0 - clamp(dot(n, v), 0.0, 1.0);
    lit += lit_by(rim_direction, rim_color * (0.25 + 0.75 * edge * edge), n, t, v, body, light_of, film) * 0.6;
    vec3 sky = mix(ground_color, sky_color, 0.5 + 0.5 * dot(n, up_direction));
    return lit + sky * body * 0.42 + sky * 0.10 * film.x * film_color(clamp(dot(n, v), 0.0, 1.0), film.y);
}
