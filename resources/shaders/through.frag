// What a camera sees over a plate, mixed as light is.
in vec2 at;
uniform sampler2D picture;   // sRGB times what is covered
uniform sampler2D plate;     // sRGB
uniform vec4 box;            // of the plate on the screen: left, top, right, bottom with y down
uniform float screen_height;
uniform float opacity;
layout(location = 0) out vec4 out_color;

void main()
{
    vec4 seen = textureLod(picture, at, 0.0);
    float share = seen.a * opacity;
    if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0))) || share <= 0.0)
        discard;
    vec2 pixel = vec2(gl_FragCoord.x, screen_height - gl_FragCoord.y);
    vec3 behind = textureLod(plate, (pixel - box.xy) / (box.zw - box.xy), 0.0).rgb;
    vec3 colour = min(seen.rgb / seen.a, 1.0);
    out_color = vec4(to_srgb(mix(to_linear(behind), to_linear(colour), share)), 1.0);
}
