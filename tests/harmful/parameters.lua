-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries a million parameters.
local rd = require "refdyn"
local n = 0
while true do n = n + 1; rd.parameter("p" .. n, 1) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
