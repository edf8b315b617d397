// Depths as they are.
in vec2 unused;
uniform sampler2D depths;

void main()
{
    gl_FragDepth = texelFetch(depths, ivec2(gl_FragCoord.xy), 0).r;
}
