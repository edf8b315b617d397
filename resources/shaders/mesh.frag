// Skin, lit at every sample.
in vec3 position;
in vec3 normal;
in float value;
layout(location = 0) out vec4 out_color;

void main()
{
    vec3 v = to_viewer(position);
    vec3 n = normalize(normal + 1e-12);
    if (dot(n, v) < 0.0 && !gl_FrontFacing) n = -n;
    out_color = skin(position, n, v, value);
}
