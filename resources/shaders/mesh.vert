uniform mat4 clip_from_world;
in vec3 in_position;
in vec3 in_normal;
in float in_value;
out vec3 position;
out vec3 normal;
out float value;

void main()
{
    position = in_position;
    normal = in_normal;
    value = in_value;
    gl_Position = clip_from_world * vec4(in_position, 1.0);
}
