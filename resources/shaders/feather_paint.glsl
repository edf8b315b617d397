// What a feather is painted with.
uniform bool has_picture;
uniform sampler2D picture;
uniform vec2 picture_corner, picture_extent;
uniform vec4 under;          // colour the underside is washed with, how strongly

vec4 picture_at(vec2 place)
{
    return texture(picture, (place - picture_corner) / picture_extent);
}

vec3 washed(vec3 body, bool back)
{
    return back ? mix(body, under.rgb, under.a) : body;
}
