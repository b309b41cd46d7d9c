-- expect: 4: more than 100 million steps to read the model; look for a loop without an end
-- Tries a loop over all integers.
local rd = require "refdyn"
for i = math.mininteger, math.maxinteger do end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
