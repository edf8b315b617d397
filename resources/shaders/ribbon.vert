// Camera-facing ribbons. The vertex number says strand, point and side; as much is added on both sides
// as a pixel reaches over the edge.
uniform sampler2D strand_sides;
uniform sampler2D strand_colors;
uniform mat4 clip_from_world;
uniform vec2 picture_size;   // samples
uniform float samples_per_pixel;   // on a side
uniform float margin;              // added on both sides
out float from_middle;
out float half_width;
out vec2 boxes;
out vec4 color;
out float along;              // 0 root .. 1 tip
flat out float strand_seed;

void main()
{
    int number = gl_VertexID >> 1;
    int strand = number / points_per_strand;
    int point = number - strand * points_per_strand;
    int row = strand / strands_per_row;
    ivec2 at = ivec2((strand - row * strands_per_row) * points_per_strand + point, row);
    vec4 side = texelFetch(strand_sides, at, 0);
    color = texelFetch(strand_colors, at, 0);
    along = float(point) / float(points_per_strand - 1);
    strand_seed = float(strand % 4096) * 0.6180339;
    half_width = side.z * samples_per_pixel + margin;
    vec2 extent = abs(side.xy);
    boxes = vec2(max(extent.x, extent.y), max(min(extent.x, extent.y), 0.02));
    from_middle = (float(gl_VertexID & 1) * 2.0 - 1.0) * (half_width + 0.5 * (boxes.x + boxes.y));
    gl_Position = clip_from_world * vec4(strand_point(strand, point), 1.0);
    gl_Position.xy += side.xy * from_middle * 2.0 / picture_size * gl_Position.w;
}
