// How much of what is behind it a feather hides: more or fewer samples are kept, by a noise that is fixed on the screen.
float screen_noise(vec2 pixel)   // interleaved gradient noise, Jimenez 2014
{
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

bool let_through(float cover)
{
    return cover < 0.999 && screen_noise(gl_FragCoord.xy) >= cover;
}
