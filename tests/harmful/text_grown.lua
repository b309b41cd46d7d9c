-- expect: 5: more than 100 million steps to read the model, a loop has no end?
-- Tries a text that grows by a letter.
local rd = require "refdyn"
local s = ""
while true do s = s .. "x" end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
