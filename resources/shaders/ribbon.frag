// Exact part of a square pixel that a straight strip covers: the pixel seen along the strip is two boxes folded (a
// trapezoid), whose integral over the width is taken in closed form. A hair thinner than a pixel covers just its area,
// so that thin hair fades instead of breaking into dots.
in float from_middle;
in float half_width;
in vec2 boxes;   // larger and smaller extent of the pixel across the strip
in vec4 color;
layout(location = 0) out vec4 out_color;

float ramp(float x)
{
    x = max(x, 0.0);
    return 0.5 * x * x;
}

float part_below(float x)
{
    float outer = 0.5 * (boxes.x + boxes.y), inner = 0.5 * (boxes.x - boxes.y);
    x = clamp(x, -outer, outer);
    return (ramp(x + outer) - ramp(x + inner) - ramp(x - inner)) / (boxes.x * boxes.y);
}

void main()
{
    float covered = part_below(from_middle + half_width) - part_below(from_middle - half_width);
    covered = clamp(covered, 0.0, 1.0) * color.a;
    out_color = vec4(color.rgb * covered, covered);
}
