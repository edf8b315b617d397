uniform mat4 clip_from_world;
in vec3 in_position, in_normal, in_fibre, in_color;
in vec4 in_light;
in vec2 in_film;
in float in_opacity;
in vec2 in_flat;
out vec3 position, normal, fibre, color;
out vec4 light_of;      // gloss, roughness, anisotropy, transmission
out vec2 film;          // strength, nanometres
out float opacity;
out vec2 flat_place;

void main()
{
    position = in_position;
    normal = in_normal;
    fibre = in_fibre;
    color = in_color;
    light_of = in_light;
    film = in_film;
    opacity = in_opacity;
    flat_place = in_flat;
    gl_Position = clip_from_world * vec4(in_position, 1.0);
}
