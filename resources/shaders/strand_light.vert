// Hairs as lines one texel wide, seen from the key light.
uniform mat4 light_from_world;
uniform int strand_step;   // every how many strands are drawn
uniform int first_strand;  // how many of those were drawn before
uniform int point_step;    // and points

void main()
{
    int point = min(gl_VertexID * point_step, points_per_strand - 1);
    gl_Position = light_from_world * vec4(strand_point((first_strand + gl_InstanceID) * strand_step, point), 1.0);
}
