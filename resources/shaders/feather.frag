in vec3 position, normal, fibre, color;
in vec4 light_of;
in vec2 film;
in float opacity;
in vec2 flat_place;
layout(location = 0) out vec4 out_color;

void main()
{
    vec4 shown_here = has_picture ? picture_at(flat_place) : vec4(0.0, 0.0, 0.0, 1.0);
    if (let_through(opacity * shown_here.a)) discard;
    bool back = !gl_FrontFacing;
    vec3 body = washed(has_picture ? to_linear(shown_here.rgb) : color, back);
    out_color = vec4(shown(lit_feather(position, normal, fibre, body, light_of, film, back)), 1.0);
}
