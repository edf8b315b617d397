in float opacity;
in vec2 flat_place;

void main()
{
    if (let_through(opacity * (has_picture ? picture_at(flat_place).a : 1.0))) discard;
}
