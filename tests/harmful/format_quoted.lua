-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to quote bytes 0, each of which becomes a number.
local rd = require "refdyn"
local text = ("\n\0"):rep(500000)
for i = 1, 1e9 do local quoted = ("%q"):format(text) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
