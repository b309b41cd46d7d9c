-- expect: 4: table.move: more work than the 100 million steps that a model may take while it is read
-- Tries texts that the library converts to numbers.
local rd = require "refdyn"
table.move({}, "1", "1000000000", "2")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
