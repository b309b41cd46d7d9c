-- expect: 0: a text of more than 4 MB; texts must be shorter
-- Tries a text that doubles.
local rd = require "refdyn"
local s = "x"
while true do s = s .. s end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
