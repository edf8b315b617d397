// A line of constant width in pixels; it fades with the distance, and where lines come too close together.
in vec2 at;
noperspective in float off;
noperspective in float spacing;
flat in vec4 color;
uniform float grid_reach;
uniform float width;         // of a line in samples
layout(location = 0) out vec4 out_color;

void main()
{
    float fade = clamp(1.15 - (1.15 / (grid_reach * grid_reach)) * dot(at, at), 0.0, 1.0);
    float covered = clamp((1.0 - abs(off)) * width, 0.0, 1.0) * clamp(0.2 * spacing - 1.0, 0.0, 1.0);
    out_color = vec4(color.rgb, 1.0) * (color.a * covered * fade);
}
