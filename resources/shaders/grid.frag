// Lines of constant width in pixels at every step and, stronger, every tenth; both fade with the distance.
in vec2 at;
uniform vec2 grid_phase;     // of the centre, within ten steps, metres
uniform float grid_step, grid_reach;
uniform float small_part;    // how far the lines at every step have come in
uniform vec2 grid_origin;    // of the world, from the centre: its axes are coloured
uniform vec3 grid_color, axis_colors[2];
layout(location = 0) out vec4 out_color;

float lines(vec2 p, float distance, vec2 pixel)
{
    vec2 off = abs(fract(p / distance - 0.5) - 0.5) * distance / pixel;
    vec2 covered = clamp(1.0 - off, 0.0, 1.0) * clamp(0.35 * distance / pixel - 1.0, 0.0, 1.0);
    return max(covered.x, covered.y);
}

void main()
{
    vec2 pixel = max(fwidth(at), vec2(1e-9));
    vec2 p = at + grid_phase;
    float fade = smoothstep(1.0, 0.15, length(at) / grid_reach);
    float strength = max(0.30 * small_part * lines(p, grid_step, pixel), 0.55 * lines(p, 10.0 * grid_step, pixel));
    vec2 axis = clamp(1.3 - abs(at - grid_origin) / pixel, 0.0, 1.0);
    vec3 color = grid_color;
    if (max(axis.x, axis.y) > 0.0) {
        color = axis.y > axis.x ? axis_colors[0] : axis_colors[1];
        strength = max(strength, 0.8 * max(axis.x, axis.y));
    }
    out_color = vec4(shown(color), 1.0) * (strength * fade);
}
