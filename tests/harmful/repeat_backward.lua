-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to reduce the count of steps: a text repeated a negative number of times.
local rd = require "refdyn"
local text = ("x"):rep(-1e15)
while true do text = text .. "" end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
