-- expect: 4: string.format: more than the 100 million steps that reading a model may take
-- Tries wide fields and many digits.
local rd = require "refdyn"
for i = 1, 1e9 do string.format("%99.99f%99.99f%99.99f%99.99f", 1e308, -1e308, 1e308, 1e308) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
