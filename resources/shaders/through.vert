// A grid over the plate, each node with its place in the picture of the pinhole that drew it.
in vec2 place;   // pixels of the screen with y down, the corners of pixels at whole numbers
in vec2 found;   // in the picture, 0 .. 1 from its left upper corner
uniform vec2 picture_size;
out vec2 at;

void main()
{
    at = found;
    vec2 clip = place / picture_size * 2.0 - 1.0;
    gl_Position = vec4(clip.x, -clip.y, 0.0, 1.0);
}
