-- expect: 4: table.move: more than the 100 million steps that reading a model may take
-- Tries texts that the library converts to numbers.
local rd = require "refdyn"
table.move({}, "1", "1000000000", "2")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
