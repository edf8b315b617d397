// Lines of the ground as strips two pixels wide: what lies between them costs nothing. First those along the second
// axis, then as many along the first. What cannot be seen of one is cut off here.
uniform mat4 clip_from_world;
uniform vec3 grid_centre, grid_right, grid_forward;   // the last two span the ground
uniform float grid_reach, grid_step;
uniform int grid_lines;      // on each side of the middle one, a multiple of ten
uniform int grid_every;      // steps from one to the next: 1 or 10
uniform vec2 grid_phase;     // of the centre, within ten steps, metres
uniform vec2 grid_origin;    // of the world, from the centre: its axes are coloured
uniform float small_part;    // how far the lines at every step have come in
uniform vec3 grid_color, axis_colors[2];   // as the target holds them
uniform vec2 half_pixels;    // half the size of the picture, pixels
out vec2 at;
noperspective out float off;       // the middle of the line, pixels
noperspective out float spacing;   // to the next line of its kind, pixels
flat out vec4 color;               // and the strength

const float RESOLVED = 5.0;  // pixels of spacing at which lines begin to show
const int END[6] = int[6](0, 1, 0, 0, 1, 1);   // of two triangles of a strip
const float SIDE[6] = float[6](-1.0, -1.0, 1.0, 1.0, -1.0, 1.0);

// The part of -1 .. 1 along `middle + t * half_line` that lies within the picture and a little more.
vec2 part_in_sight(vec4 middle, vec4 half_line)
{
    vec2 part = vec2(-1.0, 1.0);
    for (int border = 0; border < 4; border++) {
        vec4 plane = vec4(0.0, 0.0, 0.0, 1.1);
        plane[border >> 1] = (border & 1) == 0 ? 1.0 : -1.0;
        float inside = dot(plane, middle), slope = dot(plane, half_line);
        if (slope > 0.0) part.x = max(part.x, -inside / slope);
        else if (slope < 0.0) part.y = min(part.y, -inside / slope);
        else if (inside < 0.0) return vec2(0.0);
    }
    return part;
}

void main()
{
    int line = gl_VertexID / 6, count = 2 * grid_lines + 1;
    bool first = line < count;
    int number = (line % count - grid_lines) * grid_every;
    float place = float(number) * grid_step - (first ? grid_phase.x : grid_phase.y);
    vec3 across = first ? grid_right : grid_forward, along = first ? grid_forward : grid_right;
    bool tenth = line % count * grid_every % 10 == 0;
    bool axis = abs(place - (first ? grid_origin.x : grid_origin.y)) < 0.1 * grid_step;
    color = axis ? vec4(first ? axis_colors[1] : axis_colors[0], 0.24)
                 : vec4(grid_color, tenth ? 0.11 : 0.05 * small_part);
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // out of sight, unless there is something to see
    at = vec2(0.0);
    off = spacing = 0.0;

    float reach = sqrt(max(grid_reach * grid_reach - place * place, 0.0));
    vec4 middle = clip_from_world * vec4(grid_centre + across * place, 1.0);
    vec4 half_line = clip_from_world * vec4(along * reach, 0.0);
    vec2 part = part_in_sight(middle, half_line);
    vec4 a = middle + part.x * half_line, b = middle + part.y * half_line;
    if (part.x >= part.y || min(a.w, b.w) <= 0.0) return;
    vec2 run = (b.xy / b.w - a.xy / a.w) * half_pixels;
    if (dot(run, run) < 1e-6) return;
    vec2 beside = normalize(vec2(-run.y, run.x));

    // parallel lines come together evenly in the picture
    vec4 next = clip_from_world * vec4(across * (tenth ? 10.0 * grid_step : grid_step), 0.0);
    vec2 apart = abs(vec2(dot((next.xy - a.xy / a.w * next.w) / a.w * half_pixels, beside),
                          dot((next.xy - b.xy / b.w * next.w) / b.w * half_pixels, beside)));
    if (axis) apart = vec2(1e3);
    if (max(apart.x, apart.y) <= RESOLVED) return;
    float cut = (RESOLVED - apart.x) / (apart.y - apart.x);
    float end = END[gl_VertexID % 6] == 0 ? (apart.x < RESOLVED ? cut : 0.0) : (apart.y < RESOLVED ? cut : 1.0);

    float t = end * a.w / mix(b.w, a.w, end);   // what is even in the picture is not so in the world
    float far = mix(part.x, part.y, t) * reach;
    at = first ? vec2(place, far) : vec2(far, place);
    off = SIDE[gl_VertexID % 6];
    spacing = mix(apart.x, apart.y, end);
    gl_Position = mix(a, b, t);
    gl_Position.xy += beside * off / half_pixels * gl_Position.w;
}
