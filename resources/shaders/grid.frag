// Lines of constant width in pixels at every step and, stronger, every tenth; both fade with the distance.
// It covers much of the picture: divisions are few and nothing branches.
in vec2 at;
uniform vec2 grid_phase;     // of the centre, within ten steps, metres
uniform float grid_step, grid_reach;
uniform float small_part;    // how far the lines at every step have come in
uniform vec2 grid_origin;    // of the world, from the centre: its axes are coloured
uniform vec3 grid_color, axis_colors[2];   // as the target holds them
uniform float width;         // of a line in samples
layout(location = 0) out vec4 out_color;

vec2 lines(vec2 p, vec2 pixels_a_step)   // p in steps
{
    vec2 covered = 1.0 - abs(fract(p - 0.5) - 0.5) * pixels_a_step;
    return clamp(covered * width, 0.0, 1.0) * clamp(0.35 * pixels_a_step - 1.0, 0.0, 1.0);
}

void main()
{
    float fade = clamp(1.15 - (1.15 / (grid_reach * grid_reach)) * dot(at, at), 0.0, 1.0);
    vec2 pixels_a_metre = 1.0 / (max(fwidth(at), vec2(1e-9)) * width);
    vec2 pixels_a_step = pixels_a_metre * grid_step;
    vec2 p = (at + grid_phase) * (1.0 / grid_step);
    vec2 few = lines(0.1 * p, 10.0 * pixels_a_step), many = lines(p, pixels_a_step);
    float strength = max(0.045 * small_part * max(many.x, many.y), 0.10 * max(few.x, few.y));
    vec2 axis = clamp((1.0 - abs(at - grid_origin) * pixels_a_metre) * width, 0.0, 1.0);
    float nearer = max(axis.x, axis.y);
    vec3 color = nearer > 0.0 ? (axis.y > axis.x ? axis_colors[0] : axis_colors[1]) : grid_color;
    out_color = vec4(color, 1.0) * (max(strength, 0.24 * nearer) * fade);
}
