// What is behind everything: a plate where there is one, else a gradient. Display colours.
uniform float picture_height;
uniform vec3 top_color, bottom_color;
uniform sampler2D plate;
uniform vec4 plate_box;   // left, bottom, right, top in pixels from the picture's lower left corner; empty for none

vec3 background(vec2 pixel)
{
    vec2 at = (pixel - plate_box.xy) / max(plate_box.zw - plate_box.xy, vec2(1.0));
    if (plate_box.z > plate_box.x && all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(1.0))))
        return textureLod(plate, vec2(at.x, 1.0 - at.y), 0.0).rgb;
    return mix(bottom_color, top_color, pixel.y / picture_height);
}

float dither(vec2 pixel)   // half a step, against bands (Jimenez 2014)
{
    return (fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) - 0.5) / 255.0;
}
