// An image in a box of the picture.
uniform vec2 picture_size;
uniform vec4 box;   // left, top, right, bottom in pixels with y down, the corners of pixels at whole numbers
out vec2 at;

void main()
{
    at = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
    vec2 clip = mix(box.xy, box.zw, at) / picture_size * 2.0 - 1.0;
    gl_Position = vec4(clip.x, -clip.y, 0.0, 1.0);
}
