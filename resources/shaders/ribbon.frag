// Coverage of a line of any width by a box filter one pixel wide, exact across the line: a hair thinner than a pixel
// covers just its width, so that thin hair fades instead of breaking into dots.
noperspective in float from_middle;
noperspective in float half_width;
noperspective in vec4 color;
layout(location = 0) out vec4 out_color;

void main()
{
    float d = abs(from_middle);
    float covered = clamp(min(half_width, d + 0.5) - max(-half_width, d - 0.5), 0.0, 1.0) * color.a;
    out_color = vec4(color.rgb * covered, covered);
}
