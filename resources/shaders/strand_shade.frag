// One fragment per point of every hair: its light, and the ribbon's side on the screen. Drawn into textures that the
// ribbons read, so that every point is shaded once however often it is used.
in vec2 unused;
uniform sampler2D strand_tints;    // rgb factor, a factor on the width
uniform sampler2D strand_normals;  // of the skin at the root
uniform int strand_count;
uniform vec2 widths;               // root and tip, metres
uniform vec3 root_color, tip_color;
uniform bool sparse;               // a few wide hairs stand for all
uniform float blend;
uniform float gloss, roughness, absorption;
uniform mat4 clip_from_world;
uniform vec2 picture_size;         // pixels
uniform float pixels_at_one;       // pixels per metre where clip w is 1
layout(location = 0) out vec4 out_side;
layout(location = 1) out vec4 out_color;

float lobe(float sines, float shift, float width)
{
    float x = (sines - shift) / width;
    return exp(-0.5 * x * x) / width;
}

// Highlights after Marschner 2003 with the cheap lobes of Karis 2016: R, TT and TRT about a fibre along t.
vec3 highlights(vec3 t, vec3 l, vec3 v, vec3 body, float backlit)
{
    float sin_l = dot(t, l), sin_v = dot(t, v);
    vec3 across_l = l - sin_l * t, across_v = v - sin_v * t;
    float cos_phi = dot(across_l, across_v) * inversesqrt(dot(across_l, across_l) * dot(across_v, across_v) + 1e-6);
    float cos_half = sqrt(clamp(0.5 + 0.5 * cos_phi, 0.0, 1.0));
    float s = sin_l + sin_v;
    float r = lobe(s, -0.14, roughness * 0.9) * 0.25 * cos_half;
    float trt = lobe(s, 0.16, roughness * 1.9) * (0.15 + 0.85 * cos_half * cos_half * cos_half);
    float tt = lobe(s, 0.05, roughness * 1.2) * exp(-3.65 * cos_phi - 3.98);
    vec3 tinted = body / max(max(body.r, body.g), max(body.b, 1e-4));
    return mix(vec3(1.0), tinted, 0.4) * (0.045 * r) + body * (0.11 * trt) + pow(body, vec3(0.7)) * (0.5 * tt * backlit);
}

void main()
{
    int column = int(gl_FragCoord.x), row = int(gl_FragCoord.y);
    int in_row = column / points_per_strand;
    int point = column - in_row * points_per_strand;
    int strand = row * strands_per_row + in_row;
    if (strand >= strand_count) discard;
    int last = points_per_strand - 1;
    float u = float(point) / float(last);
    float up = sparse ? 1.0 - (1.0 - u) * (1.0 - u) * (1.0 - u) : u;   // of a sparse coat parts are seen that others would hide
    vec3 p = strand_point(strand, point);
    vec3 before = point > 0 ? strand_point(strand, point - 1) : p;
    vec3 after = point < last ? strand_point(strand, point + 1) : p;
    vec3 along = after - before;
    vec3 t = along * inversesqrt(max(dot(along, along), 1e-20));
    vec4 tint = texelFetch(strand_tints, ivec2(in_row, row), 0);
    vec3 n = texelFetch(strand_normals, ivec2(in_row, row), 0).xyz;

    // where it lies on the screen: unit normal of the line and half its width, pixels
    vec4 clip = clip_from_world * vec4(p, 1.0);
    vec4 a = clip_from_world * vec4(before, 1.0), b = clip_from_world * vec4(after, 1.0);
    vec2 line = (b.xy / max(b.w, 1e-6) - a.xy / max(a.w, 1e-6)) * picture_size;
    float length2 = dot(line, line);
    vec2 side = length2 > 1e-12 ? vec2(-line.y, line.x) * inversesqrt(length2) : vec2(1.0, 0.0);
    float width = mix(widths.x, widths.y, u * u) * tint.a;
    if (sparse) width = min(width, 0.42 * distance(strand_point(strand, 0), strand_point(strand, last)));
    out_side = vec4(side, min(0.5 * width * pixels_at_one / max(clip.w, 1e-6), 4096.0), 1.0);   // w <= 0 behind the eye

    // colour of the fibre: dark root to light tip
    float k = clamp(up / max(2.0 * blend, 1e-3), 0.0, 1.0);
    vec3 body = mix(root_color, tip_color, k * k * (3.0 - 2.0 * k)) * tint.rgb;

    vec3 v = to_viewer(p);
    vec3 across = n - t * dot(n, t);
    across = normalize(across + 0.35 * n + 1e-5);
    vec2 key = key_light(p);
    // deep hair is lit by light that other hairs scattered: the lighter the hair, the farther it gets, and the warmer
    vec3 swallowed = absorption * (1.0 - 0.55 * sqrt(clamp(body, 0.0, 1.0)));
    if (sparse) swallowed *= 0.6;
    vec3 through = key.x * exp(-key.y * swallowed);
    float openness = mix(0.22, 1.0, smoothstep(0.0, 0.85, up));

    float sin_key = sqrt(max(1.0 - dot(t, key_direction) * dot(t, key_direction), 0.0));
    float facing = clamp((dot(across, key_direction) + 0.2) / 1.2, 0.0, 1.0);
    vec3 light = key_color * through * sin_key * mix(0.1, 1.0, facing) * 0.34;
    float sin_fill = sqrt(max(1.0 - dot(t, fill_direction) * dot(t, fill_direction), 0.0));
    light += fill_color * openness * sin_fill * clamp((dot(across, fill_direction) + 0.4) / 1.4, 0.0, 1.0) * 0.55;
    light += mix(ground_color, sky_color, 0.5 + 0.5 * dot(across, up_direction)) * openness * 0.34;
    vec3 color = body * light;

    float gate = clamp(dot(n, key_direction) * 2.0 + 0.7, 0.0, 1.0);
    color += gloss * key_color * through * gate * mix(0.35, 1.0, openness) * highlights(t, key_direction, v, body, 0.4);
    float edge = 1.0 - clamp(dot(n, v), 0.0, 1.0);
    float rim_gate = clamp(dot(n, rim_direction) * 1.6 + 0.15, 0.0, 1.0) * edge * edge * openness;
    color += rim_color * rim_gate * (highlights(t, rim_direction, v, body, 1.0) * gloss + 0.18 * body);
    out_color = vec4(shown(color), 1.0);
}
