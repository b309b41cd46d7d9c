-- expect: 5: string.lower: more than the 100 million steps that reading a model may take
-- Tries to reverse a long text again and again.
local rd = require "refdyn"
local s = ("x"):rep(1e6)
for i = 1, 1e6 do s = s:reverse():upper():lower() end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
