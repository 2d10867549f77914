//! A sketch of each effect in three lines, for screens and text: what is drawn is dashed or thin, what is built is heavy.

/// Columns of the widest sketch.
#[cfg(test)]
pub(crate) const WIDEST: usize = 26;

/// The sketch of an effect by its name; none for one the user defined.
pub(crate) fn of(effect: &str) -> Option<[&'static str; 3]> {
    SKETCHES.iter().find(|(name, _)| *name == effect).map(|(_, sketch)| *sketch)
}

const SKETCHES: &[(&str, [&str; 3])] = &[
    ("axis_roll", ["  ━━▭━━━━━━ level", "       ↻", "  ━━━━━━▱━━ rolls over"]),
    ("axis_pitch", ["         ▱ lifts", "  ▭    ╱", "  ━━━━━ bowed upright"]),
    ("axis_yaw", ["         ▱ seen from", "  ▭    ╱   above", "  ━━━━━ bowed sideways"]),
    ("joint_zero", ["     ╱ where it stands", "    ╱ ↕", "   ◯╌╌╌╌ where it says"]),
    ("joint_gain", ["says 0   30   60   90", "     ┼────┼────┼────┤", "is   0    31    62    93"]),
    ("link_length", ["  ◯━━━━━━━━━━━◯ built", "  ◯╌╌╌╌╌╌╌╌◯ drawn", "            ←→"]),
    ("link_offset", ["   ━━◯╌╌╌ drawn", "     ┃ ↕", "     ◯━━━ built"]),
    ("link_twist", ["  ╎ drawn   ╱ built", "  ◯━━━━━━━━◯", "           ╱"]),
    ("axis_skew", ["    ╎ ╱ the axis leans", "    ╎╱", "  ━━◯━━━━"]),
    ("tool_offset", ["  ━━━━┓", "      ┃ ←→", "      ╵  • the tip"]),
    ("joint_compliance", ["  ◯╌╌╌╌╌╌╌ unloaded", "   ╲ turns in the joint", "    ╲━━━━━▼ weight"]),
    ("joint_stiffening", ["  turn  ╭──── stiffens", "      ╭─╯", "   ───╯   moment"]),
    ("gravity_flexure", ["  ◯╌╌╌╌╌╌╌ without weight", "   ╲ turns in the joint", "    ╲━━━━━▼ how heavy?"]),
    ("joint_backlash", ["   ┃╲ ╱┃   the tooth", "   ┃ ▼ ┃   lies left or", "   → ← gap  right"]),
    ("joint_harmonic", ["   ╭╮  ╭╮  ╭╮", "  ╱  ╲╱  ╲╱  ╲ error", "  ── turns of a wheel ──"]),
    ("screw_wave", ["   ╭╮  ╭╮  ╭╮", "  ╱  ╲╱  ╲╱  ╲ error", "  ├───┤ turn of the screw"]),
    ("positioning_error", ["      ╱╲___", "  ───╱     ╲ error", "  ├──┼──┼──┼─ travel"]),
    ("joint_settling", ["  ──╮ asked", "     ╲", "      ╰─── creeps in"]),
    ("joint_coupling", ["  ↻ ◯━━━━◯ ↻", "  one joint turns,", "  the other turns along"]),
    ("joint_step", ["         ┌──── after", "  ───────┘", "  before   it slipped"]),
    ("link_sag", ["  ┃━━━╸╌╌╌╌╌ straight", "      ╲━━╸", "         ╲━━▼ weight"]),
    ("thermal_growth", ["  ◯━━━━━━━━━◯ cool", "  ◯━━━━━━━━━━━◯ warm", "             ←→"]),
    ("warm_up", ["         ╭────── warm", "      ╭──╯", "  ────╯ since it started"]),
    ("drift", ["            ╱╱", "      ╱╱╱╱╱", "  ╱╱╱╱  with time"]),
    ("base_tilt", ["        ┃  ╱", "     ╱━━┻━━", "  ╌╌╱╌╌╌╌╌╌╌ level"]),
    ("base_position", ["    ╎     ┃", "    ╎     ┃", "  ╌╌┴╌╌ →━┻━━ stands here"]),
    ("scale", ["  reads ├──┼──┼──┤", "  true  ├───┼───┼───┤", "  the ruler is short"]),
    ("instrument_tilt", ["     ╱▔╲ the instrument", "    ╱  ╱ leans", "  ━┻━━┻━━━"]),
    ("trigger_height", ["     ▽  sensor", "     ↕  fires too high", "  ━━━━━━━━ or too low"]),
    ("trigger_spot", ["     ▽", "    ( ) half the spot", "  ████━━━━ over the edge"]),
    ("trigger_hysteresis", ["  on   ┌────", "     ↑ │↓", "  off ─┘  not the same"]),
    ("reflectance", ["     ▽", "    ╱ ╲ less comes back", "  ▒▒▒▒▒▒▒▒"]),
    ("reading_reset", ["  reads ──╮  ╭── 0 moved", "          ╰──╯", "  rows  1   2   3"]),
    ("reading_rescaled", ["  reads ├──┼──┼──┤", "  later ├───┼───┼───┤", "  another scale"]),
    ("base_shifted", ["  ╌╌◯   ◯ ← anchor", "    ╎ → ┃   or foot", "  before after"]),
    ("base_reset", ["    △ →    ◁ set up", "   before   anew", "  ━━━━━━━━━━━━━"]),
    ("target_reset", ["  ━━━━┓ before", "      ╵○ → • put back", "           elsewhere"]),
    ("joint_zero_reset", ["      ╭──╮   ╭── zero", "  ────╯  ╰───╯", "  found anew each time"]),
    ("sensor_tilt", ["      ▷ leans", "     ╱", "  ━━━━━━━━"]),
    ("camera_aim", ["   ▭ camera", "   ╎╲ looks aside", "   ╎ ╲"]),
    ("camera_roll", ["   ┌────┐", "   │ ↻  │ the picture", "   └────┘ is turned"]),
    ("camera_scale", ["      ▭", "    ╱╱ ╲╲ wider or", "   ╱╱   ╲╲ narrower"]),
    ("principal_point", ["   ┌────┐", "   │ +• │ its middle", "   └────┘ lies beside"]),
    ("lens_distortion", ["   ╭────╮ straight", "   │    │ lines bend", "   ╰────╯"]),
    ("stripe_plane", ["    ╎ ╱ the sheet of", "    ╎╱  light leans", "  ━━━━━━━━"]),
    ("stripe_bow", ["    ╎ ╲", "    ╎  │ the sheet bends", "    ╎ ╱"]),
    ("hand_eye", ["  ━━━┓ flange", "     ╎ ←→", "     ╵  ▭ camera, light"]),
    ("clock_skew", ["  ◯──→◯ moved on", "  •     the picture", "        came late"]),
];

#[cfg(test)]
mod tests {
    use plumb_calibration::effect::kinds;

    use super::*;

    #[test]
    fn every_effect_of_the_library_has_a_sketch_that_fits_a_card() {
        for kind in kinds() {
            let sketch = of(kind.name).unwrap_or_else(|| panic!("{} has no sketch", kind.name));
            for line in sketch {
                assert!(
                    line.chars().count() <= WIDEST,
                    "{}: {line} takes {} columns",
                    kind.name,
                    line.chars().count()
                );
            }
        }
    }
}
