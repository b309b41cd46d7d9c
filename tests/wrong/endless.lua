-- expect: 4: more than 100 million steps to read the model, a loop has no end?
local n = 0
while true do
  n = n + 1
end
