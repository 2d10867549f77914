//! The laser line sensor and the measuring probe of a world file, and what they look at or feel.

use std::collections::BTreeMap;

use plumb_document::Spanned;
use serde::Deserialize;

use super::checker::{Checker, Number};
use super::placed::RawPlaced;
use crate::arm::description::{LineSensor, Sight, TouchProbe};
use crate::instrument::Instrument;
use crate::physics::rigid::Vector;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawLineSensor {
    sensor: RawPlaced,
    width_mm: Option<Number>,
    near_mm: Option<Number>,
    far_mm: Option<Number>,
    error_mm: Option<Number>,
    #[serde(default)]
    planes: BTreeMap<String, RawPlane>,
    #[serde(default)]
    balls: BTreeMap<String, RawBall>,
    #[serde(default)]
    edges: BTreeMap<String, RawEdge>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawTouchProbe {
    ball_radius_mm: Option<Number>,
    reach_mm: Option<Number>,
    error_mm: Option<Number>,
    division_mm: Option<Number>,
    #[serde(default)]
    planes: BTreeMap<String, RawPlane>,
    #[serde(default)]
    balls: BTreeMap<String, RawBall>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlane {
    point_mm: [f64; 3],
    normal: Spanned<[f64; 3]>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBall {
    centre_mm: [f64; 3],
    radius_mm: Number,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEdge {
    point_mm: [f64; 3],
    direction: Spanned<[f64; 3]>,
}

impl Checker<'_> {
    pub(super) fn line_sensor(&self, raw: &RawLineSensor) -> LineSensor {
        let length = |key: &str, value: &Option<Number>, default: f64| {
            self.typed.or(key, value, default, 0.0..=5000.0, "mm")
        };
        let edges = raw.edges.iter().map(|(name, edge)| {
            let (point, direction) = (Vector::from(edge.point_mm), self.unit(&edge.direction));
            (name.clone(), Sight::Edge { point, direction })
        });
        LineSensor {
            flange_from_sensor: self.placed("sensor", &raw.sensor, 1000.0),
            half_width: length("width_mm", &raw.width_mm, 60.0) / 2.0,
            reach: [length("near_mm", &raw.near_mm, 50.0), length("far_mm", &raw.far_mm, 400.0)],
            error: self.typed.or("error_mm", &raw.error_mm, 0.0, 0.0..=50.0, "mm"),
            sights: self.faces(&raw.planes, &raw.balls).into_iter().chain(edges).collect(),
        }
    }

    pub(super) fn touch_probe(&self, raw: &RawTouchProbe) -> TouchProbe {
        let length = |key: &str, value: &Option<Number>, default: f64| {
            self.typed.or(key, value, default, 0.0..=50.0, "mm")
        };
        TouchProbe {
            ball_radius: length("ball_radius_mm", &raw.ball_radius_mm, 0.0),
            reach: length("reach_mm", &raw.reach_mm, 2.0),
            instrument: Instrument {
                error: length("error_mm", &raw.error_mm, 0.0),
                division: length("division_mm", &raw.division_mm, 0.0),
            },
            sights: self.faces(&raw.planes, &raw.balls),
        }
    }

    fn faces(
        &self,
        planes: &BTreeMap<String, RawPlane>,
        balls: &BTreeMap<String, RawBall>,
    ) -> Vec<(String, Sight)> {
        let planes = planes.iter().map(|(name, plane)| {
            let (point, normal) = (Vector::from(plane.point_mm), self.unit(&plane.normal));
            (name.clone(), Sight::Plane { point, normal })
        });
        let balls = balls.iter().map(|(name, ball)| {
            let radius = self.typed.number("radius_mm", &ball.radius_mm, 0.1..=1000.0, "mm");
            (name.clone(), Sight::Ball { centre: Vector::from(ball.centre_mm), radius })
        });
        planes.chain(balls).collect()
    }

    fn unit(&self, raw: &Spanned<[f64; 3]>) -> Vector {
        Vector::from(raw.value).unit().unwrap_or_else(|| {
            self.typed.wrong(raw.span, "this points nowhere; three numbers, not all of them zero");
            Vector::Z
        })
    }
}
