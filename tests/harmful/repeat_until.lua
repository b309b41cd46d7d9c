-- expect: 4: more than 100 million steps to read the model; look for a loop without an end
-- Tries a loop of repeat.
local rd = require "refdyn"
repeat until false
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
