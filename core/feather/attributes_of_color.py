"""Rows of the table of attributes: colour, pattern and how a feather takes the light. See ``attributes``."""

from __future__ import annotations

from core.feather.attributes_of_form import Row

BANDS = ("Red", "Green", "Blue")


def _color(name: str, color: tuple[float, float, float], what: str) -> tuple[Row, ...]:
    return tuple(
        ("color", f"{name}{band}", value, "", 0.0, 1.0, f"{band} of {what}")
        for band, value in zip(BANDS, color, strict=True)
    )


COLOR_ROWS: tuple[Row, ...] = (
    *_color("colorBase", (0.16, 0.13, 0.10), "the vane at its base"),
    *_color("colorMiddle", (0.28, 0.20, 0.13), "the vane in its middle"),
    *_color("colorTip", (0.30, 0.20, 0.12), "the vane at its tip"),
    *_color("colorInner", (0.30, 0.24, 0.18), "the wider vane along the shaft"),
    *_color("colorEdge", (0.55, 0.42, 0.28), "the fringe along the edge"),
    *_color("colorTipBand", (0.60, 0.50, 0.38), "the band at the tip"),
    *_color("colorBar", (0.05, 0.035, 0.025), "the bars"),
    *_color("colorSpot", (0.75, 0.65, 0.5), "the spots"),
    *_color("colorStreak", (0.07, 0.045, 0.03), "the streak along the shaft"),
    *_color("colorDown", (0.42, 0.39, 0.36), "the down"),
    *_color("colorUnder", (0.5, 0.48, 0.45), "what the underside is washed with"),
    *_color("shaftColorRoot", (0.62, 0.52, 0.38), "the shaft at its root"),
    *_color("shaftColorTip", (0.16, 0.10, 0.06), "the shaft at its tip"),
    ("color", "shaftColorBlend", 0.35, "", 0.0, 1.0, "Where along the shaft its two colours meet"),
    ("color", "colorBasePosition", 0.25, "", 0.0, 1.0, "Where along the vane the colour of the base ends"),
    ("color", "colorTipPosition", 0.75, "", 0.0, 1.0, "Where along the vane the colour of the tip is reached"),
    ("color", "colorInner*", 0.0, "", 0.0, 1.0, "How much of the inner colour the vane shows near the shaft"),
    ("color", "colorInnerWidth*", 0.5, "", 0.01, 1.0, "How far from the shaft the inner colour reaches"),
    ("color", "colorUnderStrength", 0.35, "", 0.0, 1.0, "How strongly the underside is washed with its colour"),
    ("color", "colorNoise", 0.08, "", 0.0, 1.0, "How much the colour of single feathers differs in brightness"),
    ("pattern", "edgeStrength*", 0.0, "", 0.0, 1.0, "How strongly the edge of the vane is fringed with its colour"),
    ("pattern", "edgeWidth*", 0.18, "", 0.0, 1.0, "Width of the fringe, as a share of the vane"),
    ("pattern", "edgeSoftness", 0.08, "", 0.005, 0.5, "How softly the fringe ends"),
    ("pattern", "tipBandStrength", 0.0, "", 0.0, 1.0, "How strongly the tip carries a band"),
    ("pattern", "tipBandWidth", 0.06, "", 0.0, 0.6, "Length of the band at the tip"),
    ("pattern", "tipBandSoftness", 0.02, "", 0.002, 0.3, "How softly the band at the tip ends"),
    ("pattern", "tipBandCurve", 0.3, "", -1.0, 1.0, "How far the band at the tip follows the outline"),
    ("pattern", "barStrength*", 0.0, "", 0.0, 1.0, "How strongly the vane is barred"),
    ("pattern", "barCount", 7.0, "", 0.0, 60.0, "Number of bars from base to tip"),
    ("pattern", "barWidth", 0.4, "", 0.02, 0.98, "Width of a bar against the distance of bars"),
    ("pattern", "barSoftness", 0.12, "", 0.01, 0.5, "How softly bars end"),
    ("pattern", "barAngle*", 0.3, "", -1.5, 1.5, "How far bars reach forward from the shaft to the edge"),
    ("pattern", "barPhase*", 0.0, "", 0.0, 1.0, "Where bars begin, in bars; sides that differ alternate"),
    ("pattern", "barWaver", 0.12, "", 0.0, 1.0, "How irregular bars are"),
    ("pattern", "barStart", 0.0, "", 0.0, 1.0, "Where along the vane bars begin"),
    ("pattern", "barEnd", 1.0, "", 0.0, 1.0, "Where along the vane bars end"),
    ("pattern", "barEdge*", 1.0, "", 0.0, 1.0, "How far from the shaft to the edge bars reach"),
    ("pattern", "spotStrength*", 0.0, "", 0.0, 1.0, "How strongly the vane is spotted"),
    ("pattern", "spotCount", 6.0, "", 0.0, 60.0, "Number of rows of spots from base to tip"),
    ("pattern", "spotAcross*", 1.0, "", 1.0, 8.0, "Number of spots across the vane"),
    ("pattern", "spotSize", 0.3, "", 0.02, 0.6, "Radius of spots against their distance"),
    ("pattern", "spotLength", 1.0, "", 0.2, 4.0, "Length of spots along the feather against their width"),
    ("pattern", "spotSoftness", 0.1, "", 0.01, 0.5, "How softly spots end"),
    ("pattern", "spotWaver", 0.15, "", 0.0, 1.0, "How irregularly spots are set"),
    ("pattern", "spotStart", 0.05, "", 0.0, 1.0, "Where along the vane spots begin"),
    ("pattern", "spotEnd", 0.98, "", 0.0, 1.0, "Where along the vane spots end"),
    ("pattern", "streakStrength", 0.0, "", 0.0, 1.0, "How strongly a streak follows the shaft"),
    ("pattern", "streakWidth*", 0.22, "", 0.0, 1.0, "Width of the streak, as a share of the vane"),
    ("pattern", "streakSoftness", 0.1, "", 0.005, 0.5, "How softly the streak ends"),
    ("pattern", "streakTaper", 0.5, "", -1.0, 1.0, "How much narrower the streak is towards the tip"),
    ("pattern", "mottleStrength", 0.0, "", 0.0, 1.0, "How strongly the vane is mottled with the colour of the bars"),
    ("pattern", "mottleScale", 0.04, "", 0.004, 0.5, "Size of the mottles"),
    ("pattern", "mottleSharpness", 0.5, "", 0.0, 1.0, "How sharply mottles end"),
    ("light", "vaneGloss*", 0.35, "", 0.0, 4.0, "Strength of the highlight across the barbs"),
    ("light", "vaneRoughness*", 0.28, "rad", 0.03, 1.5, "Width of the highlight along the barbs"),
    ("light", "vaneAnisotropy*", 0.85, "", 0.0, 1.0, "How far the highlight follows the direction of the barbs"),
    ("light", "vaneOpacity*", 1.0, "", 0.0, 1.0, "How much of what is behind the vane it hides"),
    ("light", "vaneTransmission*", 0.3, "", 0.0, 1.0, "How much light from behind shines through the vane"),
    ("light", "downOpacity", 0.75, "", 0.0, 1.0, "How much of what is behind them down hairs hide"),
    ("light", "downTransmission", 0.6, "", 0.0, 1.0, "How much light from behind shines through the down"),
    ("light", "shaftGloss", 0.7, "", 0.0, 4.0, "Strength of the highlight of the shaft"),
    ("light", "shaftRoughness", 0.22, "rad", 0.03, 1.5, "Width of the highlight of the shaft"),
    ("light", "shaftTransmission", 0.15, "", 0.0, 1.0, "How much light from behind shines through the shaft"),
    ("light", "iridescence*", 0.0, "", 0.0, 1.0, "Strength of the colours of thin films in the barbules"),
    ("light", "iridescenceThickness", 380.0, "", 100.0, 1200.0, "Thickness of the films, in nanometres"),
    ("light", "iridescenceIndex", 1.56, "", 1.2, 2.5, "Refractive index of the films; 1.56 is keratin"),
    ("light", "iridescenceStart", 0.3, "", 0.0, 1.0, "Where along the vane the iridescence begins"),
    ("light", "iridescenceSpread", 0.5, "", 0.05, 2.0, "How wide a view the iridescence is seen over"),
    ("light", "iridescenceNoise", 0.05, "", 0.0, 0.5, "How much the thickness of the films differs between barbs"),
)
