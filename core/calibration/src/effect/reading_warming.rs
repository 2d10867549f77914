//! The zero of a reading shifts with temperature.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Channel, Contribution, Dof, Effect, EffectId, Parameter, Sample, Site, Unit};

/// Greatest plausible shift a kelvin. Data sheets of draw wires and of optical triangulation give a hundredth of a percent of the range, of poor ones a
/// tenth: 1 mm is that of a wire of a metre, mm/K. Of levels and theodolites it is thousandths of a degree: 0.1 deg is far beyond, rad/K.
const MOST_MM: f64 = 1.0;
const MOST_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// Degrees a kelvin; radians inside.
const DEG_PER_K: Unit = Unit { name: "deg/K", factor: Unit::DEG.factor };

/// Millimetres a kelvin.
const MM_PER_K: Unit = Unit { name: "mm/K", factor: 1.0 };

#[derive(Debug)]
struct ReadingWarming {
    channel: Channel,
    parameters: [Parameter; 1],
}

impl Effect for ReadingWarming {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let warmer = sample.warmer_than_reference();
        contributions.push(Contribution { parameter: 0, dof: Dof::ReadingZero(self.channel), rate: warmer });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "reading_warming",
    family: Family::Instrument,
    sites: SiteKind::Readings,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Temperature,
    sentence: "The zero of one reading shifts as the instrument gets warmer.",
    how_to_see: "A fixed point read cold and warm, whatever the arm does, with the temperature logged.",
    sketch: ["  ├──●────── cool", "  ├────●──── warm", "   0 ←→ moved"],
    build: |setting: &Setting<'_>| {
        let Site::Reading(channel) = setting.id.site else {
            return Err(setting.unusable("needs a reading, such as distance"));
        };
        let parameter = match channel.is_length() {
            true => Parameter::new("mm_per_k", MM_PER_K, (-MOST_MM, MOST_MM)),
            false => Parameter::new("deg_per_k", DEG_PER_K, (-MOST_RAD, MOST_RAD)),
        };
        Ok(Box::new(ReadingWarming { channel, parameters: [parameter] }))
    },
    candidates: |context| match context.summary.temperature_range {
        Some(range) if range > 0.0 => {
            // What sees whole points warms in all its axes at once, and not along those of its frame: of coordinates it has to be written by name.
            let coordinates = [Channel::X, Channel::Y, Channel::Z];
            let read = context.summary.channels.iter().filter(|channel| !coordinates.contains(channel));
            read.map(|channel| EffectId::at("reading_warming", Site::Reading(*channel))).collect()
        }
        _ => Vec::new(),
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_model::{AddedEffect, Model};
    use crate::effect::{CandidateContext, DatasetSummary, build, parse};
    use crate::fit::ResidualModel;
    use crate::measurement::Observations;
    use crate::table::Table;

    const ARM: &str = "
arm: link
convention: distal
joints: [{name: shoulder, a_mm: 400}]
base: {free: false}
targets: {p1: {free: false}}
surfaces: {nail: {point_mm: [400, 300, 0], free: false}}
level: {after: shoulder}
measured_from: world
";

    fn model() -> Model {
        Model::parse("m.yaml", ARM).unwrap()
    }

    /// What is read more in the first row with an effect of this size, mm and rad.
    fn read_more(effect: &str, value: f64, temperature: &str) -> Vec<f64> {
        let model = model();
        let header = "q1_deg,distance_mm,distance_to,tilt_x_deg,temperature_c";
        let table = Table::parse("t.csv", &format!("{header}\n0,300,nail,0,{temperature}\n")).unwrap();
        let observations = Observations::new(&model, &table).unwrap();
        let residuals = |effects: &[AddedEffect]| {
            let problem = ResidualModel::new(&model, &table, &observations, effects).unwrap();
            problem.residuals(&problem.start())
        };
        let added = AddedEffect { id: parse(effect, &model).unwrap(), values: vec![value] };
        residuals(&[]).iter().zip(residuals(&[added])).map(|(without, with)| without - with).collect()
    }

    #[test]
    fn a_reading_grows_by_so_much_for_a_kelvin_above_twenty_degrees_and_no_other_does() {
        let close = |found: Vec<f64>, tilt: f64, distance: f64| {
            assert!((found[0] - tilt).abs() < 1e-12 && (found[1] - distance).abs() < 1e-9, "{found:?}");
        };
        close(read_more("reading_warming(distance)", 0.05, "30"), 0.0, 0.5);
        close(read_more("reading_warming(distance)", 0.05, "18"), 0.0, -0.1);
        close(read_more("reading_warming(distance)", 0.05, ""), 0.0, 0.0);
        close(read_more("reading_warming(tilt_x)", -1e-4, "25"), -5e-4, 0.0);
        close(read_more("reading_warming(tilt_y)", -1e-4, "25"), 0.0, 0.0);
    }

    #[test]
    fn its_size_is_in_the_unit_of_the_reading_a_kelvin_and_has_a_limit_on_either_side() {
        let model = model();
        let of = |text: &str| build(&parse(text, &model).unwrap(), &model).unwrap();
        let size = |text: &str, value: f64| {
            of(text).size(&[value], &nalgebra::DMatrix::from_element(1, 1, value * value))
        };
        let (wire, level) =
            (size("reading_warming(height)", 0.05), size("reading_warming(tilt_y)", 1_f64.to_radians()));
        assert_eq!((wire.value, wire.error, wire.unit), (0.05, 0.05, "mm/K"));
        assert!((level.value - 1.0).abs() < 1e-12 && level.unit == "deg/K", "{level:?}");
        let plausible = |text: &str, value: f64| of(text).plausible(&[value]);
        for sign in [1.0, -1.0] {
            assert!(plausible("reading_warming(distance)", sign * 0.99));
            assert!(!plausible("reading_warming(distance)", sign * 1.01));
            assert!(plausible("reading_warming(tilt_x)", sign * 0.099_f64.to_radians()));
            assert!(!plausible("reading_warming(tilt_x)", sign * 0.101_f64.to_radians()));
        }
        let nowhere = build(&EffectId::at("reading_warming", Site::Base), &model).unwrap_err().to_string();
        assert!(nowhere.contains("needs a reading, such as distance"), "{nowhere}");
    }

    #[test]
    fn it_is_a_candidate_where_the_temperature_varies_and_for_coordinates_never() {
        let offered = |columns: &str, rows: [&str; 2]| {
            let model = model();
            let text = format!("q1_deg,{columns}\n0,{}\n9,{}\n", rows[0], rows[1]);
            let table = Table::parse("t.csv", &text).unwrap();
            let summary = DatasetSummary::of(&model, &table);
            let found = (KIND.candidates)(&CandidateContext { model: &model, summary: &summary });
            found.iter().map(|id| model.label(id)).collect::<Vec<_>>()
        };
        let columns = "p1_x_mm,distance_mm,distance_to,temperature_c";
        assert_eq!(offered(columns, ["5,6,nail,20", "5,6,nail,20.5"]), ["reading_warming(distance)"]);
        assert!(offered(columns, ["5,6,nail,20", "5,6,nail,20"]).is_empty(), "a temperature that stays");
        assert!(offered("distance_mm,distance_to", ["6,nail", "6,nail"]).is_empty(), "none logged");
        assert!(offered("p1_x_mm,temperature_c", ["5,20", "5,25"]).is_empty(), "coordinates alone");
    }
}
