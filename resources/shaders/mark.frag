// The part of a pixel that a line or a circle covers, from the distance of its centre.
in vec2 at;
flat in vec4 ends;
flat in vec4 shape;
flat in vec4 color;
uniform vec2 dash;   // drawn and left out, pixels
layout(location = 0) out vec4 out_color;

void main()
{
    if (shape.x < 0.0) {
        out_color = vec4(color.rgb, 1.0) * color.a;
        return;
    }
    vec2 line = ends.zw - ends.xy, from = at - ends.xy;
    float length2 = dot(line, line);
    float part = length2 > 0.0 ? clamp(dot(from, line) / length2, 0.0, 1.0) : 0.0;
    float away = abs(distance(at, ends.xy + part * line) - shape.x);
    float covered = clamp(shape.y + 0.5 - away, 0.0, min(1.0, 2.0 * shape.y));
    if (shape.z >= 0.0) {
        float along = mod(shape.z + part * sqrt(length2), dash.x + dash.y);
        covered *= clamp(min(along, dash.x - along) + 0.5, 0.0, 1.0);
    }
    if (covered <= 0.0) discard;
    out_color = vec4(color.rgb, 1.0) * (color.a * covered);
}
