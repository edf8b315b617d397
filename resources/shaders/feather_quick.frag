in vec3 color;
in float opacity;
in vec2 flat_place;
layout(location = 0) out vec4 out_color;

const float GREY = 0.735;   // what the vertices were lit with, as it is shown; a root stands for the screen's curve

void main()
{
    vec4 shown_here = has_picture ? picture_at(flat_place) : vec4(1.0);
    if (let_through(opacity * shown_here.a)) discard;
    vec3 tint = mix(shown_here.rgb, sqrt(under.rgb), gl_FrontFacing ? 0.0 : under.a) / GREY;
    out_color = vec4(has_picture ? color * tint : color, 1.0);
}
