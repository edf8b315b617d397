// Points of strands live in one R32F texture, whole strands in every row, laid out as the array came:
// value index inside a strand = axis * axis_stride + point * point_stride.
uniform sampler2D strand_points;
uniform int points_per_strand;
uniform int strands_per_row;
uniform int axis_stride;
uniform int point_stride;

vec3 strand_point(int strand, int point)
{
    int row = strand / strands_per_row;
    int column = (strand - row * strands_per_row) * 3 * points_per_strand + point * point_stride;
    return vec3(
        texelFetch(strand_points, ivec2(column, row), 0).r,
        texelFetch(strand_points, ivec2(column + axis_stride, row), 0).r,
        texelFetch(strand_points, ivec2(column + 2 * axis_stride, row), 0).r);
}
