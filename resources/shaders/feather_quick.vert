// Feathers lit at their vertices alone: for moving pictures. What is painted with a picture is lit as if it were grey.
uniform mat4 clip_from_world;
in vec3 in_position, in_normal, in_fibre, in_color;
in vec4 in_light;
in vec2 in_film;
in float in_opacity;
in vec2 in_flat;
out vec3 color;
out float opacity;
out vec2 flat_place;

void main()
{
    gl_Position = clip_from_world * vec4(in_position, 1.0);
    bool back = dot(in_normal, to_viewer(in_position)) < 0.0;
    vec3 body = has_picture ? vec3(0.5) : washed(in_color, back);
    color = shown(lit_feather(in_position, in_normal, in_fibre, body, in_light, in_film, back));
    opacity = in_opacity;
    flat_place = in_flat;
}
