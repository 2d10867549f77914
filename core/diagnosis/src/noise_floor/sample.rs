//! Which returns are looked at where a table has more than can be held.

/// The most numbers that the columns of all returns may have, 160 MB of them. A gap that may differ from pose to pose has a column a pose
/// and joint, so that columns times returns grow with the square of the table: of 1,500 poses visited twice this is just reached, and
/// one sigma is known to 1 % by then.
const MOST_NUMBERS: usize = 20_000_000;

/// Columns of effects that depend on conditions, for an arm of six joints, about; and equations of a return.
const COLUMNS: usize = 100;
const EQUATIONS: usize = 3;

/// Poses that are kept whole before returns to one pose are left out.
const MANY_POSES: usize = 50;

/// The groups of returns, or a part of them spread evenly over the table where all are more than can be held. The same part each time.
pub(super) fn sampled(mut groups: Vec<Vec<usize>>, joints: usize) -> Vec<Vec<usize>> {
    while numbers(&groups, joints) > MOST_NUMBERS {
        let members: usize = groups.iter().map(Vec::len).sum();
        let poses = groups.len();
        // Poses go before returns while there are many of them: columns grow with poses and rows with both.
        if poses > MANY_POSES && members < 8 * poses {
            groups = every_other(groups);
        } else if groups.iter().any(|rows| rows.len() > 3) {
            groups = groups
                .into_iter()
                .map(|rows| if rows.len() > 3 { every_other(rows) } else { rows })
                .collect();
        } else if poses > 1 {
            groups = every_other(groups);
        } else {
            break;
        }
    }
    groups
}

fn numbers(groups: &[Vec<usize>], joints: usize) -> usize {
    let members: usize = groups.iter().map(Vec::len).sum();
    let columns = COLUMNS.saturating_add(joints.saturating_mul(groups.len()));
    members.saturating_mul(columns).saturating_mul(EQUATIONS)
}

/// About half of them. Steps of the golden section never fall in with a pattern of the table, such as sides that take turns.
fn every_other<T>(all: Vec<T>) -> Vec<T> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let kept = all.into_iter().enumerate().filter(|(index, _)| (*index as f64 * GOLDEN).fract() < 0.5);
    kept.map(|(_, one)| one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_can_be_held_is_looked_at_whole() {
        let groups = vec![vec![0, 1, 2]; 90];
        assert_eq!(sampled(groups.clone(), 6), groups);
    }

    #[test]
    fn of_too_many_returns_a_part_is_kept_that_has_both_of_sides_that_take_turns() {
        for (poses, returns) in [(90, 2222), (100_000, 2), (1, 200_000)] {
            let groups: Vec<Vec<usize>> =
                (0..poses).map(|pose| (0..returns).map(|again| pose * returns + again).collect()).collect();
            let kept = sampled(groups, 6);
            assert!(numbers(&kept, 6) <= MOST_NUMBERS && numbers(&kept, 6) > MOST_NUMBERS / 5, "{poses}");
            assert!(kept.iter().all(|rows| rows.len() > 1), "a pose that was visited once says nothing");
            let odd = kept.iter().flatten().filter(|row| *row % 2 == 1).count();
            let all: usize = kept.iter().map(Vec::len).sum();
            assert!(odd * 3 > all && odd * 3 < all * 2, "{odd} of {all}");
        }
    }

    #[test]
    fn poses_go_before_returns_while_there_are_many_of_them_and_few_returns_to_each() {
        // With so many joints any table is too large, and half of it is not.
        let kept = |poses: usize, returns: usize| {
            let groups = vec![(0..returns).collect::<Vec<usize>>(); poses];
            let joints = (MOST_NUMBERS / (EQUATIONS * poses * returns) - COLUMNS) / poses + 1;
            assert_eq!(sampled(groups.clone(), joints - 1), groups, "it is just held");
            let kept = sampled(groups, joints);
            (kept.len(), kept.iter().map(Vec::len).max().unwrap_or(0))
        };
        // Of n every other one in steps of the golden section: about a half.
        let half = |count: usize| every_other(vec![(); count]).len();
        assert_eq!(kept(MANY_POSES + 1, 7), (half(MANY_POSES + 1), 7));
        assert_eq!(kept(MANY_POSES + 1, 8), (MANY_POSES + 1, half(8)));
        assert_eq!(kept(MANY_POSES, 7), (MANY_POSES, half(7)));
        assert_eq!(kept(MANY_POSES, 4), (MANY_POSES, half(4)));
        assert_eq!(kept(MANY_POSES, 3), (half(MANY_POSES), 3), "two returns at least are left of four");
        assert_eq!((half(2), half(4), half(5), half(10)), (1, 2, 3, 5));
    }
}
