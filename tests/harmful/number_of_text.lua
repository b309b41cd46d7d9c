-- expect: 5: tonumber: more than the 100 million steps that reading a model may take
-- Tries to read a number of a million digits, again and again.
local rd = require "refdyn"
local s = "0x" .. ("f"):rep(1e6)
for i = 1, 1e6 do tonumber(s) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
