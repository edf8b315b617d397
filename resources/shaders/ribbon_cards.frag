// A wide ribbon that stands for several hairs: thin strands side by side, each with its own brightness and end.
in float from_middle;
in float half_width;
in vec4 color;
in float along;           // 0 root .. 1 tip
flat in float strand_seed;
uniform float strands_across;
layout(location = 0) out vec4 out_color;

float hash(float n)
{
    n = fract(n * 0.1031);
    n *= n + 33.33;
    return fract(2.0 * n * n);
}

void main()
{
    float across = 0.5 + 0.5 * from_middle / max(half_width, 0.5);
    float at = across * strands_across;
    float column = floor(at);
    float seed = strand_seed + column * 17.31;
    float bright = hash(seed), end = 0.72 + 0.28 * hash(seed + 3.7);
    float pixels = 2.0 * half_width / strands_across;                // of one strand
    float from_strand = abs(at - column - 0.5) * pixels;
    float half_strand = 0.5 * pixels * mix(1.15, 0.35, along / end);
    float covered = clamp(half_strand + 0.5 - from_strand, 0.0, min(1.0, 2.0 * half_strand));
    covered *= clamp(0.5 + half_width - abs(from_middle), 0.0, 1.0);
    covered *= clamp((end - along) * 6.0, 0.0, 1.0);
    if (covered <= 0.0) discard;
    float round_ = 1.0 - 0.30 * (from_strand / max(half_strand, 0.5)) * clamp(pixels - 1.5, 0.0, 1.0);
    out_color = vec4(color.rgb * mix(0.78, 1.25, bright) * round_, 1.0) * (covered * color.a);
}
