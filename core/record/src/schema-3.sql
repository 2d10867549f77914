ALTER TABLE triggers ADD COLUMN sides TEXT;      -- JSON: the way each joint of the drive last went, +1, -1, or 0 where it has not moved
