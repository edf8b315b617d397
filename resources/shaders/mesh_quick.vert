// Skin, lit at its vertices alone: for moving pictures.
uniform mat4 clip_from_world;
in vec3 in_position;
in vec3 in_normal;
in float in_value;
out vec4 color;

void main()
{
    gl_Position = clip_from_world * vec4(in_position, 1.0);
    color = skin(in_position, normalize(in_normal + 1e-12), to_viewer(in_position), in_value);
}
