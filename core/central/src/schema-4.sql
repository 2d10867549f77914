-- When a shipper ended in good order, as when its machine is switched off for the night: then nobody has to be called because nothing is heard of its cells.
-- Empty from the moment on when a shipper of the record is there again.
ALTER TABLE records ADD COLUMN signed_off timestamptz;
