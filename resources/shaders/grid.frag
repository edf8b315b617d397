// Lines of constant width in pixels at every step and, stronger, every tenth; both fade with the distance.
in vec2 at;
uniform vec2 grid_phase;     // of the centre, within ten steps, metres
uniform float grid_step, grid_reach;
uniform float small_part;    // how far the lines at every step have come in
uniform vec2 grid_origin;    // of the world, from the centre: its axes are coloured
uniform vec3 grid_color, axis_colors[2];   // as the target holds them
uniform float width;         // of a line in samples
layout(location = 0) out vec4 out_color;

vec2 lines(vec2 p, vec2 steps_a_pixel)   // p in steps
{
    vec2 covered = 1.0 - abs(fract(p - 0.5) - 0.5) / steps_a_pixel;
    return clamp(covered * width, 0.0, 1.0) * clamp(0.35 / steps_a_pixel - 1.0, 0.0, 1.0);
}

void main()
{
    float fade = 1.15 - 1.15 * dot(at, at) / (grid_reach * grid_reach);
    if (fade <= 0.0) discard;
    vec2 pixel = max(fwidth(at), vec2(1e-9)) * width;
    vec2 step_pixel = pixel / grid_step;
    vec2 p = (at + grid_phase) / grid_step;
    vec2 few = lines(0.1 * p, 0.1 * step_pixel), many = lines(p, step_pixel);
    float strength = max(0.045 * small_part * max(many.x, many.y), 0.10 * max(few.x, few.y));
    vec2 axis = clamp((1.0 - abs(at - grid_origin) / pixel) * width, 0.0, 1.0);
    vec3 color = grid_color;
    if (max(axis.x, axis.y) > 0.0) {
        color = axis.y > axis.x ? axis_colors[0] : axis_colors[1];
        strength = max(strength, 0.24 * max(axis.x, axis.y));
    }
    out_color = vec4(color, 1.0) * (strength * min(fade, 1.0));
}
