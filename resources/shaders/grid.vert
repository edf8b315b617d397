// A large square of the ground.
uniform mat4 clip_from_world;
uniform vec3 grid_centre, grid_right, grid_forward;   // the last two span the ground
uniform float grid_reach;
out vec2 at;

void main()
{
    vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
    at = corner * grid_reach;
    gl_Position = clip_from_world * vec4(grid_centre + grid_right * at.x + grid_forward * at.y, 1.0);
}
