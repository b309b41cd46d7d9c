-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries a text as numbers, and back, again and again.
local rd = require "refdyn"
local s = ("x"):rep(2e5)
for i = 1, 1e6 do string.char(s:byte(1, -1)) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
