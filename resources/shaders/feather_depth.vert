uniform mat4 clip_from_world;
in vec3 in_position;
in float in_opacity;
in vec2 in_flat;
out float opacity;
out vec2 flat_place;

void main()
{
    opacity = in_opacity;
    flat_place = in_flat;
    gl_Position = clip_from_world * vec4(in_position, 1.0);
}
