-- expect: 4: more than 100 million steps to read the model; look for a loop without an end
local n = 0
while true do
  n = n + 1
end
