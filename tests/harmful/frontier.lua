-- expect: 5: string.find: more than the 100 million steps that reading a model may take
-- Tries a long set of letters on both sides of each place.
local rd = require "refdyn"
local set, text = "%f[" .. ("b"):rep(100000) .. "]", ("a"):rep(1000)
for i = 1, 1e9 do text:find(set) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
